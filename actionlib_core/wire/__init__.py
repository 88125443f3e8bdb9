"""What goes over the network: keys, presence tokens, encodings."""
