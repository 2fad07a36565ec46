"""The four modalities of a query: object, sound, area and image, each a heatmap."""
