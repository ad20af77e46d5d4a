"""What a record was taken with: rigs of one mass and of several, and the layout of record files."""
