"""Parts of a 3MF are compared without case, as OPC does, and named as the package writes them."""

from shapes import PRODUCTION, START, THUMBNAIL, mesh_xml, model_xml, package, rels_xml


def packed(model, more, *relations):
    rels = rels_xml((START, "/3D/Part_A.model"), *relations)
    return package(model, rels=rels, more=list(more.items()), at="3D/Part_A.model")


def test_places_and_messages_keep_the_case(judge):
    model = model_xml(f'<object id="1" odd="1">{mesh_xml()}</object>')
    report = judge(packed(model, {"Metadata/Thumb.gif": b""}, (THUMBNAIL, "/metadata/thumb.GIF")), "a.3mf")
    said = {found.code: found for found in report.findings}
    assert said["P017"].locations[0].part == "3D/Part_A.model"
    assert said["P001"].locations[0].part == "Metadata/Thumb.gif"
    assert "Metadata/Thumb.gif" in said["P001"].message


def test_a_part_that_is_missing_is_named_as_it_was_asked_for(judge):
    build = f'<build><item objectid="1"/><item objectid="1" xmlns:q="{PRODUCTION}" q:path="/3D/Other_B.model"/></build>'
    report = judge(packed(model_xml(build=build), {}), "a.3mf")
    assert any("3D/Other_B.model is not in the package" in found.message for found in report.findings)


def test_xml_that_ends_early_names_its_part(judge):
    report = judge(packed(model_xml()[:-20], {}), "a.3mf")
    assert [found.locations[0].part for found in report.findings if found.code == "F003"] == ["3D/Part_A.model"]
