"""Pictures in and out: films, folders, stacks, and the library that decodes them."""
