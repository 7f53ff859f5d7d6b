"""Place-recognition methods, all with the same interface.

`method` is the interface, `registry` contains the methods by name, and
`own_files` loads a method from a user's file. Each method is a module of its
own. Modules that only some methods need:

- BTC: `btc_planes`, `btc_voxel_order`, `btc_keypoints`, `btc_triangles`,
  `btc_verification`.
- RING++: `radon`, `local_features`.
- Layered overlap: `overlap_layers`, `overlap_maps`.
- The learned descriptor: `polar_images`.
- Networks with the weights of their authors: `published_networks`,
  `pointnetvlad_clouds`, `network_layers`, `sparse_convolution`.
"""

from cns_drake.base import attach

__getattr__, __dir__, __all__ = attach(__name__, __file__)
