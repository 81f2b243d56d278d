"""What a casting procedure must never say: each rule reads the procedure's data and names what breaks it."""

import re

from unitcad.casting.sentences import say

WORDS = {
    r"\bknife": "sharp knife",
    r"\bscissors": "small scissors",
    r"\bpin\b": "pin",
    r"\bspatula": "blunt spatula",
    r"\blay a level": "level",
    r"\bpaper\b": "paper",
    r"\bvice\b": "vice and two boards",
    r"\bpen\b": "pen",
    r"\bcotton bud": "cotton buds",
    r"\bbrush a thin coat": "small brush",
    r"\bbrush off": "hand brush",
    r"strip of stiff card": "stiff card or plastic",
    r"\bflat pliers": "flat pliers",
    r"\bwith pliers": "narrow pliers",
    r"\bsolder (the|on|wires)": "soldering iron and solder",
    r"release agent, if any": "release agent",
    r"tape over the underside": "wide adhesive tape",
    r"petroleum jelly|\bgrease the": "petroleum jelly",
    r"isopropanol": "isopropanol and lint-free wipes",
    r"syringe of isopropanol": "rinsing syringe",
    r"\boven\b": "oven",
    r"post-cure": "curing lamp",
    r"varnish": "acrylic varnish",
}
"""What a step's words name, in lower case, and the line of the bill that it asks for."""


def layers_named(texts):
    """The layers (from 0, -1 for the last) whose silicone an assembly's words ask for."""
    said = re.findall(r"(?:Layer (\d+)|(last) layer)'s silicone", " ".join(texts))
    return [-1 if last else int(layer) - 1 for layer, last in said]


def broken_rules(procedure):
    """Return what a procedure does wrong, one sentence each; empty where it keeps every rule."""
    return [fault for rule in RULES for fault in rule(procedure)]


def _agent(procedure):
    """Keep release agent off what bonds later: at most the last cup's bore gets some, and every cup's step says so."""
    last = procedure.pours[-1].index
    for pour in procedure.pours:
        for step in pour.steps:
            if said := re.search(r"Release agent, if any, [^.]*only on ([^.]*), away from", step.text):
                if pour.index != last:
                    yield f"pour {pour.index}: release agent before the last pour"
                if said[1] not in (f"the bore of cup {last}", f"the sheet's bed and the bores of cup {last}"):
                    yield f"pour {pour.index}: release agent on {said[1]}, not on the last cup's bore"
            if re.fullmatch(r"Cup \d+ on", step.title) and "release agent" not in step.text.lower():
                yield f"pour {pour.index}: says nothing of release agent"


def _degassing(procedure):
    """Degas every pour where there is a vacuum; ask for nothing that needs one where there is none."""
    for pour in procedure.pours:
        says = any(step.text.startswith("Degas for") and step.minutes > 0 for step in pour.steps)
        if procedure.vacuum and not says:
            yield f"pour {pour.index}: not degassed, though there is a vacuum"
        needs = [figure.name for figure in pour.figures if "vacuum" in figure.name or "degassing" in figure.name]
        if not procedure.vacuum and (says or needs):
            yield f"pour {pour.index}: asks for a vacuum that is not there: {', '.join(needs) or 'degassing'}"
    needs = [item.item for item in procedure.bill if "degassing" in item.item or "vacuum" in item.note]
    if needs and not procedure.vacuum:
        yield f"the bill asks for a vacuum that is not there: {', '.join(needs)}"


def _held(procedure):
    """Hold an open cup down before it is struck off, and pull the tongue before a cup is lifted."""
    for pour in procedure.pours:
        strike, hold = _titled(pour.steps, "Strike off"), _titled(pour.steps, f"Hold cup {pour.index} down")
        cups = any(step.title == f"Cup {pour.index} on" for step in pour.steps)
        if cups and strike is not None and (hold is None or hold > strike):
            yield f"pour {pour.index}: nothing holds the cup down while it is struck off"
        inserted, pull = (_titled(pour.steps, title) for title in ("Tongue home", "Tongue out FIRST"))
        lift = _titled(pour.steps, f"Cup {pour.index} off")
        if inserted is not None and (pull is None or lift is None or pull > lift):
            yield f"pour {pour.index}: the cup is lifted over a tongue"


def _greased(procedure):
    """Grease what seals a cup's slots before the cup hides it, with petroleum jelly, and say on which faces."""
    for pour in procedure.pours:
        titles = [step.title for step in pour.steps]
        on = f"Cup {pour.index} on"
        if "Grease the flanks" in titles:
            text = pour.steps[titles.index("Grease the flanks")].text
            if titles.index("Grease the flanks") > titles.index(on):
                yield f"pour {pour.index}: greases what the cup already hides"
            if "petroleum jelly" not in text or "face" not in text:
                yield f"pour {pour.index}: does not say what to grease with, or which faces"


def _lifted(procedure):
    """Lift the mould off the bench before a filament is pulled from under it."""
    for step in procedure.release:
        if step.title == "Filament out" and not step.text.startswith("Lift the mould off the bench"):
            yield "the filaments are pulled out while the mould lies on them"


def _cleared(procedure):
    """Clear every window for a tongue that resin may close, before the post-cure."""
    clear, cure = _first(procedure.preparation, "Clear the windows"), _first(procedure.preparation, "post-cure, bake")
    windows = [pour.index for pour in procedure.pours if _titled(pour.steps, "Tongue in, grease") is not None]
    for cup in windows if cure is not None else ():
        if clear is None or clear > cure or f"cup {cup}" not in procedure.preparation[clear].text:
            yield f"the window of cup {cup} is not cleared of resin before the post-cure"


def _shown(procedure):
    """Show every step in which a piece of the mould is put on, moved or taken off."""
    moving = re.compile(
        r"^(Cup \d+ (on|off)|Lid|Tongue|Filament|Grease the fl|Hold|Pour$|Strike|Inject|Peel|Base|Push|Try)"
    )
    for step in _all(procedure):
        if moving.match(step.title) and not step.picture:
            yield f"{step.title}: has no picture"


def _levelled(procedure):
    """Level the mould before the first pour, and say how to see it."""
    if not any("level" in step.text and "with paper" in step.text for step in procedure.preparation):
        yield "nothing says how the mould is levelled"


def _cured(procedure):
    """Cure before a mould is opened, for the silicone's whole time, and say how to tell that it is done."""
    for pour in procedure.pours:
        cures = [i for i, step in enumerate(pour.steps) if step.kind == "cure"]
        opens = [i for i, step in enumerate(pour.steps) if step.title.endswith((" off", "out FIRST")) and i]
        if len(cures) != 1 or any(i < cures[0] for i in opens if pour.steps[i].title != "Strike off"):
            yield f"pour {pour.index}: the mould is opened before the cure"
        elif pour.steps[cures[0]].wait_min < 60 * pour.cure_h - 1e-6:
            yield f"pour {pour.index}: cures for less than the silicone takes"
        elif say("cure.done") not in pour.steps[cures[0]].text:
            yield f"pour {pour.index}: nothing says how to tell cured silicone from tacky"
    fixed = any(
        "silicone adhesive" in step.required_tools or "fill the ring" in step.text for step in procedure.assembly
    )
    if fixed and procedure.assembly[-1].kind != "cure":
        yield "what holds the motor is not cured"


def _enough(procedure):
    """Mix what the cavities, and a syringe, take."""
    for pour in procedure.pours:
        values = {figure.name: figure.value for figure in pour.figures}
        density = values["density"]
        needed = values.get("to draw into the syringe, at least", 0.0) * density or values["in the cavities, net"]
        if pour.part_a_g + pour.part_b_g < needed:
            yield f"pour {pour.index}: mixes less than it takes"
        injected = any(step.title == "Inject" for step in pour.steps)
        if injected and "to draw into the syringe, at least" not in values:
            yield f"pour {pour.index}: nothing says what the syringe holds back"


def _gripped(procedure):
    """Give a cut tongue a grip."""
    for step in procedure.preparation:
        if step.title == "Cut the tongues" and "you pull by" not in step.text:
            yield "a cut tongue has nothing to pull it by"


def _propped(procedure):
    """Bear the grip of every tongue that stands, and look at the ledge only where nothing covers it."""
    for pour in procedure.pours:
        for step in pour.steps:
            if step.title == "Tongue home" and "stacked card" not in step.text:
                yield f"pour {pour.index}: nothing bears the tongue's grip"
            if pour.index > 1 and "none under it" in step.text:
                yield f"pour {pour.index}: asks to look at a ledge that Layer 1 covers"


def _listed(procedure):
    """List every tool and consumable that a step names."""
    items = {item.item for item in procedure.bill}
    for step in _all(procedure):
        for words, item in WORDS.items():
            if re.search(words, step.text.lower()) and not any(there.endswith(item) for there in items):
                yield f"the bill lacks what a step names: {item}"


def _bought(procedure):
    """Buy what the pours take of each silicone, and the ring's batch on top."""
    bought = {item.item: item.quantity for item in procedure.bill}
    batches = [(pour.material, pour.part_a_g + pour.part_b_g) for pour in procedure.pours]
    layers = set(layers_named(step.text for step in procedure.assembly if "fill the ring" in step.text))
    for material in dict.fromkeys(material for material, _ in batches):
        taken = sum(grams for name, grams in batches if name == material)
        there = sum(bought.get(f"{material} part {part}", 0.0) for part in "AB")
        smeared = any(procedure.pours[min(i, len(procedure.pours) - 1)].material == material for i in layers)
        if there < taken - 1e-6 or (smeared and there < taken + 1e-6):
            yield f"the bill lacks silicone: {material}"


def _timed(procedure):
    """Give every step its time: at the bench, or as a wait."""
    for step in _all(procedure):
        if not step.minutes and not step.wait_min:
            yield f"{step.title}: takes no time"


def _level_again(procedure):
    """Look at the level again once tape or bands run under the plate."""
    for pour in procedure.pours:
        cups = any(step.title == f"Cup {pour.index} on" for step in pour.steps)
        if cups and not any(say("hold.level_again") in step.text for step in pour.steps):
            yield f"pour {pour.index}: nothing says to look at the level again"


def _mixed_first(procedure):
    """Use no mix before it is weighed and mixed."""
    for pour in procedure.pours:
        mixed = next((i for i, step in enumerate(pour.steps) if step.kind == "mix"), len(pour.steps))
        for step in pour.steps[:mixed]:
            if "the mix " in step.text:
                yield f"pour {pour.index}: {step.title} uses the mix before it is mixed"


def _fixed(procedure):
    """Let the ring cure as long as the silicone that the steps name for it, and adhesive for a day."""
    silicones = [pour.material for pour in procedure.pours]
    hours = {pour.material: pour.cure_h for pour in procedure.pours}
    for step in procedure.assembly:
        asked = 24.0 if "silicone adhesive" in step.required_tools else None
        if "fill the ring" in step.text:
            (said,) = layers_named([step.text])
            asked = hours[silicones[min(said, len(silicones) - 1)]]
        waits = [each.wait_min for each in procedure.assembly if each.title.startswith("Let the")]
        if asked and waits and abs(waits[0] - 60 * asked) > 1e-6:
            yield "what holds the motor cures for another's time"


RULES = (
    _agent,
    _degassing,
    _held,
    _greased,
    _lifted,
    _cleared,
    _shown,
    _levelled,
    _cured,
    _enough,
    _gripped,
    _propped,
    _listed,
    _bought,
    _timed,
    _fixed,
    _level_again,
    _mixed_first,
)


def _all(procedure):
    yield from procedure.preparation
    for pour in procedure.pours:
        yield from pour.steps
    yield from (*procedure.release, *procedure.assembly)


def _titled(steps, title):
    """Return the number of the step (from 0) of that title."""
    return next((i for i, step in enumerate(steps) if step.title == title), None)


def _first(steps, words):
    """Return the number of the first step (from 0) that says so."""
    return next((i for i, step in enumerate(steps) if words in step.text), None)
