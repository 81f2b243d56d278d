"""design.html: the wish, the proposals with their sections and reasons, the front, what was left out."""

from __future__ import annotations

import shlex
from collections.abc import Mapping, Sequence
from html import escape
from typing import Any

from unitcad.report.plain_page import drawing, plain_page
from unitcad.search import design_words as words
from unitcad.text import number

_HEAD = ("", "unit", "measured", "probability", "10 to 90 %", "g", "hours", "mm")
_NUMBER = ' class="number"'


def design_page(data: Mapping[str, Any], fronts: tuple[str, str], sections: Sequence[str]) -> str:
    """Return the page of a result; `fronts`: the plot (SVG), wide and narrow; `sections`: of each proposal."""
    models = words.models_line(data)
    body = [
        '<div class="top"><div>',
        f"<h1>{escape(data['name'])}</h1>",
        f'<p class="line">{escape(words.wish_line(data["wish"]))}</p>',
        "</div></div>",
        "<section><h2>Proposals</h2>",
        _table(data["proposals"]),
        '<p class="note">Levels in per cent of the motor; mm: diameter x height. '
        f"{escape(models[0].upper() + models[1:])}. The probability is that of meeting the level; "
        "it counts what the models missed on measured units, not that a unit has never been made.</p>",
        *([f"<p>{escape(data['decides'])}</p>"] if data["decides"] else []),
        "</section>",
        *(_proposal(one, section) for one, section in zip(data["proposals"], sections, strict=True)),
        "<section><h2>What pulls apart</h2>",
        drawing(fronts[0], "probability of the level over what pulls apart from it, with the front", fronts[1]),
        "</section>",
        "<section><h2>What was tried</h2>",
        f"<p>{escape(words.tried_line(data))}. All of them stand in ranking.csv.</p>",
        _list([*words.left_out_lines(data), *words.not_castable_lines(data), *_refused(data)]),
        "</section>",
    ]
    return plain_page(f"{data['name']}: designs", "\n".join(body))


def _table(proposals: Sequence[Mapping[str, Any]]) -> str:
    head = "".join(f"<th{_NUMBER if i > 1 else ''}>{escape(text)}</th>" for i, text in enumerate(_HEAD))
    rows, other = [], words.first_other(proposals)
    for one in proposals:
        edge, measured = one["edge"], one["measured"]
        cells = [
            _measured(measured) if measured else "",
            words.share(one["probability"]),
            f"{words.percent(edge['p10'])} to {words.percent(edge['p90'])}",
            number(one["mass_g"], 2),
            number(one["cure_hours"], 3),
            f"{number(one['diameter_mm'], 3)} x {number(one['height_mm'], 3)}",
        ]
        if one["rank"] == other:
            rows.append(f'<tr><td></td><td colspan="{len(_HEAD) - 1}">{escape(words.OTHERS)}</td></tr>')
        link = f'<a href="#proposal-{one["rank"]}">{escape(words.title(one))}</a>'
        numbers = "".join(
            f'<td{_NUMBER} data-head="{escape(head)}">{escape(cell)}</td>'
            for head, cell in zip(_HEAD[2:], cells, strict=True)
        )
        rows.append(f"<tr><td>{one['rank']}</td><td>{link}</td>{numbers}</tr>")
    return (
        '<div class="scroll" tabindex="0" role="region" aria-label="proposals"><table class="stacked">'
        f"<thead><tr>{head}</tr></thead><tbody>{''.join(rows)}</tbody></table></div>"
    )


def _measured(measured: Mapping[str, Any]) -> str:
    return words.percent(measured["level"]) + ("" if measured["meets"] else ", outside")


def _proposal(one: Mapping[str, Any], section: str) -> str:
    return "\n".join(
        [
            f'<section id="proposal-{one["rank"]}"><h2>{one["rank"]}. {escape(words.title(one))}</h2>',
            f"<p><strong>{escape(words.level_line(one))}</strong></p>",
            f"<p>{escape(words.size_line(one))}</p>",
            _list(words.reasons(one)),
            drawing(section, f"section of {one['label']}"),
            f"<p>Build it: <code>unitcad build {escape(shlex.quote(one['file']))}</code></p>",
            "</section>",
        ]
    )


def _refused(data: Mapping[str, Any]) -> list[str]:
    return [
        f"{one['what']}: {one['count']} sets of lengths refused, first {one['first']}"
        for one in data["tried"]["refused"]
    ]


def _list(lines: Sequence[str]) -> str:
    return f"<ul>{''.join(f'<li>{escape(line)}</li>' for line in lines)}</ul>" if lines else ""
