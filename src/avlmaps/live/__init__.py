"""A map that lives: it takes frames and sound while a robot drives, answers questions meanwhile, and saves itself."""
