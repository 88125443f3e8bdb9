"""The page's files; `vendor` holds other people's, fetched by `.ci/vendor-web`."""
