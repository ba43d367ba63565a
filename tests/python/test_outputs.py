"""GLB files, pages and pictures."""
import base64
import json
import os
import re
import struct

import ldi
import numpy as np
import pytest
from scenes import scene

MADE = ldi.photo3d(*scene())
HAS_VIEWER = os.path.exists(os.path.join(os.path.dirname(ldi.__file__), "viewer.html"))
needs_viewer = pytest.mark.skipif(not HAS_VIEWER, reason="the package was built without the viewer: see examples/viewer/build.sh")


def json_of(glb):
    magic, version, length, json_length, kind = struct.unpack("<4sIIII", glb[:20])
    assert (magic, version, length, kind) == (b"glTF", 2, len(glb), 0x4E4F534A)
    return json.loads(glb[20 : 20 + json_length])


def compressed():
    try:
        return MADE.glb(compress=True)
    except ldi.InputError as failure:
        pytest.skip(str(failure))


def test_a_glb_has_every_triangle_and_shrinks_with_quality():
    content = json_of(MADE.glb())
    assert sum(content["accessors"][p["indices"]]["count"] for p in content["meshes"][0]["primitives"][:1]) == MADE.mesh.triangles.size
    assert content["asset"]["generator"].startswith("ldi " + ldi.__version__)
    assert len(MADE.glb(20)) < len(MADE.glb(quality=85)) == len(MADE.glb()) < len(MADE.glb(100))


def test_a_compressed_glb_is_smaller():
    glb = compressed()
    assert {"EXT_meshopt_compression", "EXT_texture_webp"} <= set(json_of(glb)["extensionsRequired"]) and len(glb) < len(MADE.glb())
    assert len(MADE.glb(20, compress=True)) < len(glb)


def test_a_glb_states_the_motion_that_its_hidden_surfaces_allow():
    def motion_in(made):
        content = json_of(made.glb())
        return content["scenes"][content["scene"]]["extras"]["motion"]

    assert motion_in(MADE) == pytest.approx(0.08)
    stairs = np.tile(20.0 + 18 * (np.arange(384) // 6 % 12), (288, 1))  # require more hidden surfaces than the limit
    assert 0 < motion_in(ldi.photo3d(np.full((288, 384, 3), 128, np.uint8), stairs, inpaint="diffusion")) < 0.08


@needs_viewer
def test_a_page_contains_the_glb():
    for options in ({}, {"quality": 50}, {"compress": True}):
        if options.get("compress"):
            compressed()
        page = MADE.html(**options)
        inside = re.search(r'<script id="photo" type="model/gltf-binary;base64">([^<]*)</script>', page)[1]
        assert base64.b64decode(inside, validate=True) == MADE.glb(**options)
        assert page.startswith("<!doctype html>") and "<title>3D photo</title>" in page and 'slot="poster"' in page


@needs_viewer
@pytest.mark.parametrize("title, shown", [("Ada & Söhne", "Ada &amp; Söhne"), ("</title><script>", "&lt;/title>&lt;script>"), ("", ""), ("\ud800", "?"), ("a\0b", "a\0b")])
def test_a_page_shows_its_title_as_text(title, shown):
    assert f"<title>{shown}</title>" in MADE.html(title) and MADE.html(title).count("<title>") == 1


@pytest.mark.skipif(HAS_VIEWER, reason="the package has the viewer")
def test_a_page_needs_the_viewer():
    with pytest.raises(ldi.FileError, match="examples/viewer/build.sh"):
        MADE.html()


def test_a_view_from_the_photo_is_close_to_the_photo():
    from_photo = MADE.render()
    assert from_photo.shape == (96, 128, 3) and abs(from_photo.astype(int) - MADE.photo).mean() < 8 and from_photo.flags.writeable
    assert MADE.render((0.05, 0, 0), target=(0, 0, -2), width=64).shape == (48, 64, 3)
    assert (MADE.render((0.05, 0, 0)) != from_photo).any()
    assert (MADE.render(samples=1, threads=1) != from_photo).any()


def test_pictures_are_written_and_read_without_loss(tmp_path):
    for picture in (MADE.photo, MADE.photo[:, :, 1]):
        ldi.write_png(tmp_path / "picture.png", picture)
        assert (ldi.read_photo(tmp_path / "picture.png") == picture.reshape(96, 128, -1)).all()


def test_options_change_the_result():
    photo, depth = scene()
    plain = ldi.photo3d(photo, depth, inpaint="diffusion", texture=0, grain=0).layers
    for options in ({"texture": 1, "grain": 0}, {"texture": 0, "grain": 1}):
        other = ldi.photo3d(photo, depth, inpaint="diffusion", **options).layers
        assert (other.color != plain.color).any() and (other.color[other.known == 1] == plain.color[plain.known == 1]).all()
    assert len(ldi.photo3d(photo, depth, inpaint="diffusion", motion=0.02).layers) < len(plain)
    wide = ldi.photo3d(photo, depth, inpaint="diffusion", focal_length=13).layers
    assert wide.focal_length == pytest.approx(plain.focal_length / 2)
    assert (ldi.photo3d(photo, depth, inpaint="diffusion", long_side=64).photo.shape) == (48, 64, 3)


def test_8_bit_inpainting_is_close_to_float():
    photo, depth = scene()
    by_int8 = ldi.photo3d(photo, depth, inpaint=ldi.inpainting_network(arithmetic="int8")).layers.color.astype(int)
    assert 0 < abs(by_int8 - MADE.layers.color).max() and abs(by_int8 - MADE.layers.color).mean() < 2


def test_a_photo_in_another_format():
    """Reads HEIC files of phones, if the package was built with libheif."""
    path = os.path.join(os.path.dirname(__file__), "..", "..", "..", "shared", "depth_companions", "iphone_portrait_pug.heic")
    if not os.path.exists(path):
        pytest.skip("needs ../shared/depth_companions")
    try:
        photo = ldi.read_photo(path)
    except ldi.InputError as failure:
        pytest.skip(str(failure))
    assert photo.dtype == np.uint8 and photo.shape[2] == 3 and photo.std() > 10
