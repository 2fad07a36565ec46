"""Published models on torch, those of the paper among them, and the reader of the maps that its code wrote."""
