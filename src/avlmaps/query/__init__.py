"""Questions: heatmaps for the four modalities, their product, and the goals in it."""
