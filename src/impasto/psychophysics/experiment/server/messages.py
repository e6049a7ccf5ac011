"""What the pages and the server say to each other, checked at the boundary."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import AfterValidator, BaseModel, ConfigDict, Field

from impasto.psychophysics.experiment.manifest import Layout, Viewing

Token = Annotated[str, Field(pattern=r"^[A-Za-z0-9_-]{1,40}$")]
Observer = Annotated[str, Field(pattern=r"^[A-Za-z0-9-]{1,20}$")]
Digest = Annotated[str, Field(pattern=r"^[0-9a-f]{64}$")]
Pixels = Annotated[int, Field(ge=0, le=100_000)]


def _plain(text: str) -> str:
    """Refuse what databases cannot keep: control characters, halves of surrogate pairs."""
    if not text.isprintable():
        raise ValueError("holds characters that cannot be printed")
    return text


Text = Annotated[str, Field(max_length=200), AfterValidator(_plain)]
ShortText = Annotated[str, Field(max_length=100), AfterValidator(_plain)]


class Message(BaseModel):
    """What both sides may rely on: no unknown fields, no infinite numbers."""

    model_config = ConfigDict(extra="forbid", allow_inf_nan=False)


class StatedViewing(Message):
    """The viewing conditions as the page or the laboratory states them; see `Viewing`."""

    display: ShortText = ""
    profile: ShortText = ""
    luminance_cd_m2: Annotated[float, Field(gt=0, le=10_000)] | None = None
    distance_mm: Annotated[float, Field(ge=100, le=10_000)] | None = None
    surround: Text = ""

    def stated(self) -> Viewing:
        """Return the conditions as the experiment keeps them."""
        return Viewing(**self.model_dump())


class Consent(Message):
    """The observer has agreed to take part."""

    name: Literal["consent"]
    agreed: Literal[True]


class ViewingStep(StatedViewing):
    """The viewing conditions were stated or confirmed, and what the browser says about its screen."""

    name: Literal["viewing"]
    screen_width: Pixels = 0
    screen_height: Pixels = 0
    device_pixel_ratio: Annotated[float, Field(ge=0, le=16)] = 0
    colour_depth: Annotated[int, Field(ge=0, le=64)] = 0
    colour_gamut: Literal["", "srgb", "p3", "rec2020"] = ""


class DisplayCheck(Message):
    """The display was checked by eye."""

    name: Literal["display"]
    dark_steps_seen: Annotated[int, Field(ge=0, le=16)]
    bright_steps_seen: Annotated[int, Field(ge=0, le=16)]
    grey_is_neutral: bool
    gamma: Annotated[float, Field(ge=0.5, le=5)] | None = None
    px_per_mm: Annotated[float, Field(ge=0.5, le=100)] | None = None


class Plate(Message):
    """One plate of the check of colour vision; nothing read is an empty text."""

    axis: Literal["control", "protan", "deutan", "tritan"]
    shown: Annotated[str, Field(pattern=r"^\d{1,2}$")]
    read: Annotated[str, Field(pattern=r"^\d{0,2}$")]


class ColourVision(Message):
    """The plates of the check of colour vision were read."""

    name: Literal["colour_vision"]
    plates: Annotated[list[Plate], Field(min_length=1, max_length=20)]


class Row(Message):
    """Rings of one size of the check of acuity."""

    logmar: Annotated[float, Field(ge=-1, le=3)]
    shown: Annotated[int, Field(ge=1, le=20)]
    right: Annotated[int, Field(ge=0, le=20)]


class Acuity(Message):
    """The rings of the check of acuity were read."""

    name: Literal["acuity"]
    distance_mm: Annotated[float, Field(ge=100, le=10_000)]
    px_per_mm: Annotated[float, Field(ge=0.5, le=100)]
    rows: Annotated[list[Row], Field(min_length=1, max_length=20)]


class Adaptation(Message):
    """The neutral field was looked at."""

    name: Literal["adaptation"]
    seconds: Annotated[float, Field(ge=0, le=3600)]


Step = Annotated[
    Consent | ViewingStep | DisplayCheck | ColourVision | Acuity | Adaptation, Field(discriminator="name")
]


class Window(Message):
    """In which the pictures were seen."""

    width: Pixels
    height: Pixels
    device_pixel_ratio: Annotated[float, Field(gt=0, le=16)]
    full_screen: bool
    input: Literal["key", "mouse", "touch", "pen"]


class Answer(Message):
    """The answer to a trial."""

    token: Token
    choice: Literal["left", "right", "tie"]
    response_s: Annotated[float, Field(ge=0, le=86_400)]
    window: Window


class Shown(Message):
    """A trial to be shown; see `impasto.psychophysics.experiment.sessions.Trial`."""

    token: str
    number: int
    total: int
    practice: bool
    pause: bool
    reference: str
    left: str
    right: str
    ahead: list[str]


class Next(Message):
    """The next trial; none after the last."""

    trial: Shown | None


class Recorded(Message):
    """The answer that a trial has now, and whether it had it before."""

    choice: Literal["left", "right", "tie"]
    already: bool
    trial: Shown | None


class SessionInfo(Message):
    """What the page needs to know about the session."""

    title: str
    consent: str
    instructions: str
    layout: Layout
    ties: bool
    minimum_view_s: float
    adaptation_s: float
    vision_checks: bool
    display_check: bool
    viewing: StatedViewing
    width_px: int
    height_px: int
    done: list[str]
    answered: int
    total: int


class Invite(Message):
    """Observers to invite."""

    observers: Annotated[int, Field(ge=1, le=50)] = 1
    sessions: Annotated[int, Field(ge=1, le=4)] = 1
    again: Observer | None = None
    viewing: StatedViewing | None = None


class Invited(Message):
    """A session that waits for its observer; see `impasto.psychophysics.experiment.sessions.Invitation`."""

    observer: str
    session: int
    code: str


class Forgotten(Message):
    """How many sessions were deleted."""

    sessions: int
