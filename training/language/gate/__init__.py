"""The gate's network: sentences from frames, hands and lists, and a layer on a model of English, in 8 bits."""
