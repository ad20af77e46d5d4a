"""Many records of one rig in one unattended run: motion, friction and pictures of each, one law and one report of all."""
