"""What each stage says when it is done, in words: one module per stage."""
