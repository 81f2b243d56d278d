"""Draw the bodies of the gallery's fingertip gels from published dimensions: python docs/gallery/draw_bodies.py."""

from pathlib import Path

from build123d import Align, Axis, Box, Cylinder, Pos, Sphere, Unit, export_step, fillet

HERE = Path(__file__).parent
ON_SKIN = (Align.CENTER, Align.CENTER, Align.MIN)
POCKET = Cylinder(3.5, 2.0, align=ON_SKIN)  # the motor, 7 x 2 mm, open to the skin


def pad():
    """Return a pad of the size of DIGIT's gel, 18.2 x 24.6 mm and 3.8 mm thick, its upright edges rounded by 2 mm."""
    block = Box(18.2, 24.6, 3.8, align=ON_SKIN)
    return fillet(block.edges().filter_by(Axis.Z), 2) - POCKET


def dome():
    """Return a dome of TacTip's outer radius of 20 mm, from 10 mm above its middle to 0.5 mm below its top."""
    return Pos(0, 0, -10) * Sphere(20) & Box(60, 60, 9.5, align=ON_SKIN)


if __name__ == "__main__":
    for name, solid in {"gel-pad": pad(), "gel-dome": dome() - POCKET}.items():
        solid.label = "layer1"
        export_step(solid, str(HERE / f"{name}.step"), Unit.MM)
