"""Datasets of expert episodes: `expert` makes an episode, `folder` keeps them, `minari_format` converts them."""
