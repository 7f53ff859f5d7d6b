"""Place-recognition methods: a family with one interface, `Method`.

Each method is a module of its own, which the registry finds by name; a user's
own method is a file. What several methods share, or what is large enough to be
read alone (parts of BTC), is in modules beside them.
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
