"""The device check: what the page measures, in the form of answers."""

from app.study.items import AnyItem, Choice, Number, Text

_FLAG = {"yes": "yes", "no": "no"}
DEVICE_ITEMS: dict[str, AnyItem] = {
    "webgl": Choice(id="webgl", kind="choice", text="WebGL", options=_FLAG),
    "input": Choice(
        id="input",
        kind="choice",
        text="Input device",
        options={"pointer": "sticks on the screen", "keyboard": "keyboard", "gamepad": "gamepad"},
    ),
    "gamepad": Choice(id="gamepad", kind="choice", text="Gamepad moved", options=_FLAG),
    "width_px": Number(id="width_px", kind="number", text="Width", low=1, high=20000),
    "height_px": Number(id="height_px", kind="number", text="Height", low=1, high=20000),
    "pixel_ratio": Number(id="pixel_ratio", kind="number", text="Pixel ratio", low=0.1, high=20),
    "frame_rate_hz": Number(id="frame_rate_hz", kind="number", text="Frames", low=0, high=1000),
    "round_trip_ms": Number(id="round_trip_ms", kind="number", text="Delay", low=0, high=1e6),
    "touch": Choice(id="touch", kind="choice", text="Touch screen", options=_FLAG),
    "browser": Text(id="browser", kind="text", text="Browser", max_length=400),
}
"""`browser` is free text, and as such private: a full user agent can identify a person."""
