"""The buses and the chips on them."""
