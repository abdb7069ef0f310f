"""The pictures of the README, each made by the program."""
