"""The page's files, built from `viz/web` by `make web`; `built.json` lists them."""
