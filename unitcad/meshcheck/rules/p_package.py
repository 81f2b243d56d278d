"""3MF packages, P001 to P022: the reader's findings before there is a mesh."""

from __future__ import annotations

from unitcad.meshcheck.rules.registry import Rule

P001 = Rule("""
    P001 error: content types
    [Content_Types].xml is missing, malformed, names an extension twice, or gives a part that is used no type or a wrong
    one.
    Example: The package has no part [Content_Types].xml.
    Fix: Write one Default or Override for every part, the model type
    application/vnd.ms-package.3dmanufacturing-3dmodel+xml.
""")

P002 = Rule("""
    P002 error: relationships
    A .rels part is missing or malformed, repeats an Id, points to a part that is not there, or a part that the model
    uses is not the target of a relationship. A missing thumbnail of the package is a warning, unless --3mf-strict is
    given, since PrusaSlicer writes such files.
    Example: _rels/.rels names /3D/3dmodel.model, and the package has 3D/model.model.
    Fix: List every used part once in the .rels of the part that uses it.
""")

P003 = Rule("""
    P003 error: start part
    The package needs exactly one relationship of type .../2013/01/3dmodel from its root, to a model part that exists.
    Example: _rels/.rels has two relationships of type 3dmodel.
    Fix: Write that one relationship in _rels/.rels.
""")

P004 = Rule("""
    P004 error: duplicate zip entry
    Two entries have the same part name (part names ignore case). Readers differ in which one they take.
    Example: The entries are 3D/3dmodel.model and 3D/3DModel.model.
    Fix: Write each part once.
""")

P005 = Rule("""
    P005 error: unsafe part name
    A name is absolute, climbs out with .., has a backslash, a drive, a control character, an empty segment, or a
    segment that ends with a dot.
    Example: An entry is named ../../part.model.
    Fix: Use plain relative names with forward slashes, as OPC asks.
""")

P006 = Rule("""
    P006 error: document type or entity declaration
    3MF forbids DTDs. They are the way of entity bombs and of reading files from outside.
    Example: A model part begins with `<!DOCTYPE model>`.
    Fix: Remove the DOCTYPE.
""")

P007 = Rule("""
    P007 error: target outside the package
    A relationship has TargetMode External, or its target is an address with a scheme. A printer must not fetch
    anything.
    Example: The target of a texture begins with `https:`.
    Fix: Put the part into the package.
""")

P008 = Rule("""
    P008 error: compression ratio or method
    An entry inflates by more than a thousand to one and past 1 MB, is encrypted, or uses a method other than store and
    deflate: a bomb, or unreadable to others.
    Example: An entry of 10 kB inflates to 20 MB.
    Fix: Write the package again with deflate.
""")

P009 = Rule("""
    P009 error: component depth or expansion
    Components nest deeper than 64, or their instances expand to more faces than --max-faces. Counted before anything is
    expanded.
    Example: Object 9 has ten times object 8 as its components, which has ten times object 7, and so on.
    Fix: Flatten the components, or raise --max-faces.
""")

P010 = Rule("""
    P010 error: unknown unit
    The unit is not micron, millimeter, centimeter, inch, foot or meter, spelled so.
    Example: `unit="mm"` in place of `unit="millimeter"`.
    Fix: Write one of the six.
""")

P011 = Rule("""
    P011 error: index out of range
    A triangle, polygon or property index points past the end of its list, or before its start (OBJ counts from
    1).
    Example: A triangle has `v3="8"` in a mesh of 8 vertices, which are counted from 0.
    Fix: Export again; the list and its users were written apart.
""")

P012 = Rule("""
    P012 error: dangling, forward or recursive object reference
    A build item or component names an object that is not there, is defined later, may not be used so (type other), or
    contains itself. A component of type other is a warning, unless --3mf-strict is given, since
    slicers keep modifiers so; it is not part of the build. Example: An item has `objectid="3"`, and the only object of
    the model has the id 1. Fix: Define each object before its use, and leave none out.
""")

P013 = Rule("""
    P013 error: singular transform
    A matrix has determinant zero, or is not of finite numbers: the object collapses to a plane.
    Example: `transform="1 0 0 0 1 0 0 0 0 0 0 0"` makes all heights 0.
    Fix: Write an invertible matrix.
""")

P014 = Rule("""
    P014 warning: nothing to build
    The build has no item, or no object of type model, so a printer makes nothing.
    Example: The model has `<build/>`.
    Fix: Add an item for each object to be printed.
""")

P015 = Rule("""
    P015 warning: mirrored transform
    A matrix has a negative determinant. Some slicers turn the faces inside out.
    Example: `transform="-1 0 0 0 1 0 0 0 1 0 0 0"`.
    Fix: Mirror the mesh itself.
""")

P016 = Rule("""
    P016 error: unknown required extension
    requiredextensions names a prefix without a namespace, or an extension that this reader does not
    know, so the model may mean something else than it seems.
    Example: `requiredextensions="x"` without `xmlns:x`.
    Fix: Leave the extension out, or check the file with a program that knows it.
""")

P017 = Rule("""
    P017 error: against the schema
    An element or attribute is missing, unknown, repeated, out of order, of the wrong type, or forbidden (xml:space, xsi
    attributes). Unless --3mf-strict is given, an unknown attribute without a prefix is information, and metadata of one
    name or behind the resources a warning, since common programs write such files.
    Example: A `<triangle>` has v1 and v2, and no v3.
    Fix: Write the element by its 3MF schema.
""")

P018 = Rule("""
    P018 error: duplicate id
    Two resources of one model have the same id.
    Example: A colour group and an object both have `id="2"`.
    Fix: Number them once.
""")

P019 = Rule("""
    P019 error: reference to a resource or property that is not there
    A pid, matid, texid, path or other reference has no target, a target of the wrong kind, or breaks the rules for
    combining properties. A multiproperties group that names a texture itself is a warning only, since files of the 3MF
    consortium that must pass do it. A missing default pid, and the pid of an object of components, are warnings unless
    --3mf-strict is given.
    Example: An object has `pid="5"`, and the model has no resource 5.
    Fix: Define the resource before its use.
""")

P020 = Rule("""
    P020 error: package singletons
    More than one thumbnail or print ticket for one part, or one that does not fit its relationship.
    Example: _rels/.rels has two relationships of type thumbnail.
    Fix: Keep one.
""")

P021 = Rule("""
    P021 error: content that is not checked
    The model has a beam lattice, slices, or boolean, displaced, volumetric or implicit content. The rules judge meshes
    only, so the file may have faults that they do not see. A warning, unless --3mf-strict is given.
    Example: An object has a `<b:beamlattice>`.
    Fix: Check such content with a program that knows it, or export it as a mesh.
""")

P022 = Rule("""
    P022 error: slices out of their plane
    A transform tilts an object of slices, or stretches it along z: the slice extension (1.2) allows shifts, and turns and
    scales in the plane only.
    Example: The item of an object with `s:slicestackid` is turned about x.
    Fix: Slice the object in the attitude of the build.
""")
