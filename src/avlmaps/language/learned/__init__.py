"""The learned reader: small networks that point at the words of a sentence, and what is decided of their readings."""
