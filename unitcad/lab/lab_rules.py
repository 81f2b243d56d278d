"""What can be wrong with a record or with a level: codes, what they mean and what to do, in one table."""

from __future__ import annotations

from dataclasses import asdict, dataclass

from unitcad.check.rules.rule import Rule

RULES = {
    rule.code: rule
    for rule in map(
        Rule,
        (
            """L101 error: clipped
            The samples stay at a level that the motion exceeds. Down to 0.7 of the amplitude the rest
            is fitted; below, no amplitude is given. Example: An accelerometer of 2 g at 3 g. Fix: Widen
            the sensor's range.""",
            """L102 error: sampled too slowly
            Fewer than four samples a period: the sensor's filter and aliases change the amplitude.
            Example: 400 Hz for a motor of 125 Hz. Fix: Sample at 1 kHz or faster.""",
            """L103 error: uneven time axis
            A time lies off an even grid by more than 0.3 of a step: samples are missing or the clock
            varies. Example: A logger over USB that loses a packet. Fix: Record with a hardware clock.""",
            """L104 warning: several lines
            The band holds another number of lines than the unit's key lines says, which is 1 if left
            out. They were fitted together; the strongest one's amplitude is given. Example: Two motors
            of an array. Fix: Set lines = 2 in the unit's table, run one motor, or say which line is
            meant by chain.band_hz.""",
            """L105 warning: line on the mains
            The record can't tell the line from a multiple of the mains' frequency. Example: A motor at
            100.2 Hz over 2 s. Fix: Change the drive's voltage, record longer, or add a motor-off record
            as [blank].""",
            """L106 warning: line in the comb's null
            A chain's filters pass less than 0.9 of the line. Example: A motor at 100 Hz and the paper's
            comb at 50 Hz. Fix: Use the chain line, or another drive voltage.""",
            """L107 warning: unsteady
            The amplitude varies by more than 5 %, slowly or up and down, or the frequency by more than
            5 %, beyond the spin-up; or less than half of the record is steady. Example: A battery that
            runs down. Fix: Use a regulated supply and let the motor warm up.""",
            """L108 warning: fewer than 20 periods
            The steady part is too short for the noise beside the line to be known. Example: 0.1 s at
            125 Hz. Fix: Record 2 s.""",
            """L109 warning: repeats disagree
            The repeats' logarithms scatter by more than 0.15. Example: A unit that was not taped down
            again as before. Fix: Repeat, five times or more.""",
            """L110 error: drop-outs
            More than a tenth of the samples were left out: more than a robust fit bears. Example: A
            vibrometer on bare skin. Fix: Put retroreflective tape on the point.""",
            """L111 error: no line
            The band holds no line above five times its uncertainty. Example: The motor did not run.
            Fix: Repeat.""",
            """L112 error: too few repeats
            Fewer than three usable records are left: no level is given. Example: One of three is
            clipped. Fix: Repeat.""",
            """L113 warning: no line in a part
            A section of a long record has no line where others have one; the amplitude is that of the
            others. Example: The motor stopped. Fix: Cut the record where the motor stopped, or
            repeat.""",
            """L114 warning: not fit for a chain
            The chain gives no amplitude of this record: of drop-outs, clipped samples, several lines,
            or one that is too short. Example: The chain paper and a spike. Fix: Use the chain line.""",
            """L115 warning: chains disagree
            The intervals of two chains do not overlap. Example: Hum that one chain does not remove.
            Fix: Look at the spectra of the records.""",
            """L116 error: motor and unit at different frequencies
            No line of the unit lies within a tenth of the motor's frequency: no level is given.
            Example: The reference of another motor. Fix: Record the motor at the same voltage.""",
            """L117 error: stronger line outside the band
            A line outside chain.band_hz is stronger than the one in it, which may be its harmonic.
            Example: A motor at 45 Hz and a band from 60 Hz. Fix: Widen chain.band_hz.""",
            """L118 warning: low signal to noise
            The amplitude is less than ten times the standard deviation of what the fit leaves; where
            twice its uncertainty exceeds it, it is an error. Example: A point far from the unit. Fix:
            Record longer, average more, or a sensor of a smaller range.""",
            """L119 warning: missing samples
            Samples are no numbers: empty, or NaN. They are left out; beyond a tenth of them it is an
            error. Example: A logger that writes NaN where the laser lost the surface. Fix: Put
            retroreflective tape on the point.""",
        ),
    )
}


@dataclass(frozen=True)
class LabFinding:
    """One finding: code, severity, the record or level it is about, and what was measured."""

    code: str
    severity: str
    where: str
    message: str

    def as_dict(self) -> dict[str, str]:
        """Return JSON-ready data, with what to do."""
        return {**asdict(self), "title": RULES[self.code].title, "fix": RULES[self.code].fix}


def found(code: str, where: str, message: str, severity: str | None = None) -> LabFinding:
    """Return a finding with the severity of its rule, or the one that is given."""
    return LabFinding(code, severity or RULES[code].severity, where, message)
