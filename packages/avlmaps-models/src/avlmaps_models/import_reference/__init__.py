"""Maps that the published AVLMaps/VLMaps code wrote, read and converted into ours; ``convert`` is the whole of it."""
