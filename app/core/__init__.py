"""The method, pure: values, belief, assistance. Imports numpy and numba only."""
