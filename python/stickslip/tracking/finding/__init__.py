"""What finds markers in one picture: blobs, templates, fiducial markers."""
