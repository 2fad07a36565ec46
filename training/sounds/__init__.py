"""How the embedded sound encoder was made; see README.md."""
