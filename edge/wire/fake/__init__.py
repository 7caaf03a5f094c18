"""The same chips as models on a fake bus."""
