"""Light on tubes: soft shading, ambient occlusion from the depths of pixels about, and haze with distance."""

import numpy as np

from ..units.types import FloatArray
from .camera import Camera
from .tubes import Tubes, cast

_GAMMA = 2.2
_SAMPLING = 2  # Rays per pixel along each axis of the picture.
_KEY_LIGHT = np.array([-0.45, 0.65, 0.61])
_OCCLUSION_SAMPLES = 20
_HAZE = 0.4


def shaded_image(camera: Camera, tubes: Tubes, background: FloatArray) -> FloatArray:
    """An image (height, width, 3) of sRGB values between 0 and 1, before a background (3,) that is one, too."""
    fine = camera.enlarged(_SAMPLING)
    image = np.tile(np.asarray(background) ** _GAMMA, (fine.height * fine.width, 1))
    if len(tubes.ends):
        hits = cast(fine, tubes)
        image[hits.pixels] = _light(fine, tubes, hits, image[0])
    blocks = image.reshape(camera.height, _SAMPLING, camera.width, _SAMPLING, 3)
    return np.clip(blocks.mean(axis=(1, 3)), 0.0, 1.0) ** (1.0 / _GAMMA)


def _light(camera, tubes, hits, background):
    color = tubes.colors[hits.tubes] ** _GAMMA
    shaded = tubes.shaded[hits.tubes]
    n = hits.normals
    open_sky = _openness(camera, tubes, hits)
    ambient = (0.62 + 0.2 * n[:, 1]) * open_sky
    key = np.maximum(0.0, n @ _KEY_LIGHT) * (0.4 + 0.6 * open_sky)
    halfway = _KEY_LIGHT + [0.0, 0.0, 1.0]
    gloss = 0.12 * np.maximum(0.0, n @ (halfway / np.linalg.norm(halfway))) ** 24 * open_sky
    # Rims are darker, which parts tubes of one color.
    rim = 0.45 + 0.55 * np.sqrt(np.clip(n[:, 2], 0.0, 1.0))
    lit = color * ((ambient + 0.62 * key) * rim)[:, None] + gloss[:, None]
    result = np.where(shaded[:, None], lit, color)
    near, far = camera.depths
    haze = _HAZE * np.clip((hits.depths - near) / (far - near), 0.0, 1.0)
    return result + haze[:, None] * (background - result)


def _openness(camera, tubes, hits):
    # The fraction of the sky that is free, from depths on a spiral about each pixel: what is nearer to the eye by more
    # than a radius hides it, but what is nearer by many does less.
    depths = np.full(camera.width * camera.height, np.inf)
    solid = tubes.shaded[hits.tubes]
    depths[hits.pixels[solid]] = hits.depths[solid]
    depths = depths.reshape(camera.height, camera.width)
    row, column = np.divmod(hits.pixels, camera.width)
    radius = float(np.median(tubes.radii[tubes.shaded])) if solid.any() else 1.0
    reach = 4.0 * radius * camera.scale
    hidden = np.zeros(len(row))
    for sample in range(_OCCLUSION_SAMPLES):
        angle, length = 2.399963 * sample, reach * np.sqrt((sample + 0.5) / _OCCLUSION_SAMPLES)
        other_row = np.clip(row + int(round(length * np.sin(angle))), 0, camera.height - 1)
        other_column = np.clip(column + int(round(length * np.cos(angle))), 0, camera.width - 1)
        nearer = (hits.depths - depths[other_row, other_column]) / radius
        hidden += np.clip(nearer - 0.3, 0.0, 1.0) / (1.0 + (np.maximum(nearer, 0.0) / 25.0) ** 2)
    return 1.0 - 0.95 * hidden / _OCCLUSION_SAMPLES
