"""The parts of the gallery: pictures for the README, each made from the program."""
