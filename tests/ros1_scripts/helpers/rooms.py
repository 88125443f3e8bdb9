ROOMS = {'lab': 1L, 'kitchen': 2L}
