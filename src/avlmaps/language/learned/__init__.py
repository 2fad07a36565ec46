"""The learned reader: a small network that points at the words of a sentence, beside the grammar."""
