"""The cross-modal indexing benchmark: the paper's Tables III, IV and V on homes made by rule."""
