"""Starting points: a law of each kind, estimated from the records without any iteration."""
