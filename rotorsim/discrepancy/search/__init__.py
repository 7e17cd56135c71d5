"""Search for the missing effect among the candidates, and its verdict."""
