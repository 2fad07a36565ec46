"""How the learned reader of commands and questions is made."""
