"""Write meshes with physically based materials as one binary glTF file.

trimesh keeps a base colour as eight bits per channel; in linear light a dark grey then has three
or four levels left, which shows. This writer keeps floats and knows nothing but what is drawn:
positions, normals, one texture, one material per mesh. glTF 2.0, sections 3.6, 3.7 and 3.9.
"""

import json
from dataclasses import dataclass, field

import numpy as np

from app.session.drawing.shapes import Surface

_FLOAT, _UINT16, _UINT32 = 5126, 5123, 5125  # glTF component types
_VERTICES, _INDICES = 34962, 34963  # glTF buffer targets
_MAGIC, _JSON, _BINARY = 0x46546C67, 0x4E4F534A, 0x004E4942


@dataclass(frozen=True, slots=True)
class Material:
    """How a surface answers light (metallic-roughness model).

    Attributes:
        colour: Base colour in LINEAR light, each in [0, 1]; sRGB numbers would come out pale.
        alpha: Opacity in [0, 1]; a surface below 1 is blended over what lies behind it.
        roughness, metallic: In [0, 1].
        texture: PNG of the base colour in sRGB, multiplied by `colour`, or empty.
    """

    colour: tuple[float, float, float]
    alpha: float = 1.0
    roughness: float = 0.6
    metallic: float = 0.0
    texture: bytes = field(default=b"", repr=False)


class _Buffer:
    """The binary chunk under construction and the accessors into it."""

    def __init__(self) -> None:
        self.data = bytearray()
        self.views: list[dict[str, object]] = []
        self.accessors: list[dict[str, object]] = []

    def view(self, data: bytes, **options: object) -> int:
        self.data += b"\0" * (-len(self.data) % 4)
        self.views.append(
            {"buffer": 0, "byteOffset": len(self.data), "byteLength": len(data), **options}
        )
        self.data += data
        return len(self.views) - 1

    def accessor(self, array: np.ndarray, kind: str, component: int, target: int) -> int:
        entry: dict[str, object] = {
            "bufferView": self.view(np.ascontiguousarray(array).tobytes(), target=target),
            "componentType": component,
            "count": array.size if kind == "SCALAR" else len(array),
            "type": kind,
        }
        if target == _VERTICES and kind == "VEC3":
            entry["min"] = array.min(axis=0).tolist()
            entry["max"] = array.max(axis=0).tolist()
        self.accessors.append(entry)
        return len(self.accessors) - 1


def write_glb(parts: list[tuple[Surface, Material]]) -> bytes:
    """One GLB file that holds one mesh per (surface, material), all at the origin.

    glTF takes y as up, but viser puts its content into the node's frame as it is, so coordinates
    stay those of the surfaces (z up).
    """
    buffer = _Buffer()
    meshes, materials, images = [], [], []
    for surface, material in parts:
        short = len(surface.vertices) <= 0xFFFF
        indices = surface.faces.ravel().astype(np.uint16 if short else np.uint32)
        attributes = {
            "POSITION": buffer.accessor(surface.vertices, "VEC3", _FLOAT, _VERTICES),
            "NORMAL": buffer.accessor(surface.normals, "VEC3", _FLOAT, _VERTICES),
        }
        look: dict[str, object] = {
            "baseColorFactor": [*material.colour, material.alpha],
            "roughnessFactor": material.roughness,
            "metallicFactor": material.metallic,
        }
        if material.texture and surface.uvs is not None:
            attributes["TEXCOORD_0"] = buffer.accessor(surface.uvs, "VEC2", _FLOAT, _VERTICES)
            images.append({"mimeType": "image/png", "bufferView": buffer.view(material.texture)})
            look["baseColorTexture"] = {"index": len(images) - 1}
        entry: dict[str, object] = {"pbrMetallicRoughness": look}
        if material.alpha < 1.0:
            entry |= {"alphaMode": "BLEND"}
        materials.append(entry)
        component = _UINT16 if short else _UINT32
        meshes.append(
            {
                "primitives": [
                    {
                        "attributes": attributes,
                        "indices": buffer.accessor(indices, "SCALAR", component, _INDICES),
                        "material": len(materials) - 1,
                    }
                ]
            }
        )
    document: dict[str, object] = {
        "asset": {"version": "2.0"},
        "scene": 0,
        "scenes": [{"nodes": list(range(len(meshes)))}],
        "nodes": [{"mesh": i} for i in range(len(meshes))],
        "meshes": meshes,
        "materials": materials,
        "accessors": buffer.accessors,
        "bufferViews": buffer.views,
    }
    if images:
        document["images"] = images
        document["textures"] = [{"source": i} for i in range(len(images))]
    binary = bytes(buffer.data) + b"\0" * (-len(buffer.data) % 4)
    document["buffers"] = [{"byteLength": len(binary)}]
    text = json.dumps(document, separators=(",", ":")).encode()
    text += b" " * (-len(text) % 4)
    total = 12 + 8 + len(text) + 8 + len(binary)
    head = np.array([_MAGIC, 2, total, len(text), _JSON], dtype="<u4").tobytes()
    return head + text + np.array([len(binary), _BINARY], dtype="<u4").tobytes() + binary
