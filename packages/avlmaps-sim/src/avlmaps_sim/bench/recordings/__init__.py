"""`avlmaps bench recordings`: what is noticed of recordings that cannot be right, and of those that are."""
