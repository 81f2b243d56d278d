"""The commands and kinds of files of the core."""

from unitcad.rooms import FileKind

COMMANDS = {
    name: f"unitcad.cli.{name}_command:{'list_' if name == 'list' else name}"
    for name in ("build", "check", "estimate", "report", "init", "list", "schema", "coupon", "cache")
}
FILE_KINDS = (
    FileKind("spec", "templates", "unitcad.validation:templates", "unitcad.spec.asked:AskedSpec", "", "unitcad build"),
    FileKind("custom", "custom", "unitcad.validation:custom_templates"),
    FileKind("cast-record", model="unitcad.casting.cast_record:CastRecord"),
)
