"""A small S-57 cell by hand: the bytes of ISO 8211, records and fields as the IHO's S-57 edition 3.1 has them."""

import struct

UT, FT = b"\x1f", b"\x1e"
OBJECTS = {"DEPARE": 42, "LNDARE": 71, "SOUNDG": 129, "UWTROC": 153, "WRECKS": 159, "M_COVR": 302, "M_QUAL": 308}
ATTRIBUTES = {"CATCOV": 18, "CATZOC": 72, "DRVAL1": 87, "OBJNAM": 116, "VALSOU": 179}
NODE, CONNECTED, EDGE, FEATURE = 110, 120, 130, 100
SCALE = 10_000_000
# tag: data structure and type, name, subfields, formats
FIELDS = {
    "0001": ("0500", "ISO 8211 Record Identifier", "", "(b12)"),
    "DSID": (
        "1600",
        "Data set identification field",
        "RCNM!RCID!EXPP!INTU!DSNM!EDTN!UPDN!UADT!ISDT!STED!PRSP!PSDN!PRED!PROF!AGEN!COMT",
        "(b11,b14,2b11,3A,2A(8),R(4),b11,2A,b11,b12,A)",
    ),
    "DSSI": (
        "1600",
        "Data set structure information field",
        "DSTR!AALL!NALL!NOMR!NOCR!NOGR!NOLR!NOIN!NOCN!NOED!NOFA",
        "(3b11,8b14)",
    ),
    "DSPM": (
        "1600",
        "Data set parameter field",
        "RCNM!RCID!HDAT!VDAT!SDAT!CSCL!DUNI!HUNI!PUNI!COUN!COMF!SOMF!COMT",
        "(b11,b14,3b11,b14,4b11,2b14,A)",
    ),
    "FRID": (
        "1600",
        "Feature record identifier field",
        "RCNM!RCID!PRIM!GRUP!OBJL!RVER!RUIN",
        "(b11,b14,2b11,2b12,b11)",
    ),
    "FOID": ("1600", "Feature object identifier field", "AGEN!FIDN!FIDS", "(b12,b14,b12)"),
    "ATTF": ("2600", "Feature record attribute field", "*ATTL!ATVL", "(b12,A)"),
    "FSPT": ("2600", "Feature record to spatial record pointer field", "*NAME!ORNT!USAG!MASK", "(B(40),3b11)"),
    "VRID": ("1600", "Vector record identifier field", "RCNM!RCID!RVER!RUIN", "(b11,b14,b12,b11)"),
    "VRPT": ("2600", "Vector record pointer field", "*NAME!ORNT!USAG!TOPI!MASK", "(B(40),4b11)"),
    "SG2D": ("2500", "2-D coordinate field", "*YCOO!XCOO", "(2b24)"),
    "SG3D": ("2500", "3-D coordinate (sounding array) field", "*YCOO!XCOO!VE3D", "(3b24)"),
}


def record(fields, kind="D"):
    """Return a record of (tag, bytes with their terminator)."""
    directory, at = b"", 0
    for tag, data in fields:
        directory += f"{tag}{len(data):05d}{at:06d}".encode()
        at += len(data)
    base = 24 + len(directory) + 1
    is_first = kind == "L"
    leader = f"{base + at:05d}{'3' if is_first else ' '}{kind}{'E1' if is_first else '  '} {'09' if is_first else '  '}"
    leader += f"{base:05d}{' ! ' if is_first else '   '}5604"
    return leader.encode() + directory + FT + b"".join(data for _, data in fields)


def description():
    """Return the record that says what the fields are."""
    pairs = "0001DSIDDSIDDSSI0001DSPM0001FRIDFRIDFOIDFRIDATTFFRIDFSPT0001VRIDVRIDVRPTVRIDSG2DVRIDSG3D"
    fields = [("0000", b"0000;&   " + UT + pairs.encode() + FT)]
    for tag, (control, name, subfields, formats) in FIELDS.items():
        text = f"{control};&   {name}".encode() + UT + subfields.encode() + UT + formats.encode() + FT
        fields.append((tag, text))
    return record(fields, "L")


class Cell:
    """A cell in the making: a fan of areas, points and soundings in longitude and latitude."""

    def __init__(self, **header):
        self.header = {"edition": "4", "update": "0", "datum": 2, "scale": 12000, "units": 1, **header}
        self.spatial, self.features, self.count = [], [], 0

    def _id(self):
        self.count += 1
        return self.count

    def _record(self, *fields):
        number = struct.pack("<H", len(self.spatial) + len(self.features) + 3)
        return record([("0001", number + FT), *((tag, data + FT) for tag, data in fields)])

    def _vector(self, kind, *fields):
        rcid = self._id()
        self.spatial.append(self._record(("VRID", struct.pack("<BIHB", kind, rcid, 1, 1)), *fields))
        return struct.pack("<BI", kind, rcid)

    def feature(self, layer, pointers, prim, **attributes):
        rcid = self._id()
        said = b"".join(
            struct.pack("<H", ATTRIBUTES[key]) + str(value).encode() + UT for key, value in attributes.items()
        )
        fields = [
            ("FRID", struct.pack("<BIBBHHB", FEATURE, rcid, prim, 2, OBJECTS[layer], 1, 1)),
            ("FOID", struct.pack("<HIH", 550, rcid, 1)),
            *([("ATTF", said)] if said else []),
            ("FSPT", b"".join(name + struct.pack("<BBB", 1, 1, 255) for name in pointers)),
        ]
        self.features.append(self._record(*fields))

    def area(self, layer, ring, **attributes):
        """Add an area of a closed ring: one edge from a node to itself."""
        first, *rest = [struct.pack("<ii", round(lat * SCALE), round(lon * SCALE)) for lon, lat in ring[:-1]]
        node = self._vector(CONNECTED, ("SG2D", first))
        ends = b"".join(node + struct.pack("<BBBB", 255, 255, topology, 255) for topology in (1, 2))
        edge = self._vector(EDGE, ("VRPT", ends), ("SG2D", b"".join(rest)))
        self.feature(layer, [edge], 3, **attributes)

    def point(self, layer, lon, lat, **attributes):
        node = self._vector(NODE, ("SG2D", struct.pack("<ii", round(lat * SCALE), round(lon * SCALE))))
        self.feature(layer, [node], 1, **attributes)

    def soundings(self, places):
        data = b"".join(
            struct.pack("<iii", round(lat * SCALE), round(lon * SCALE), round(depth_m * 10))
            for lon, lat, depth_m in places
        )
        self.feature("SOUNDG", [self._vector(NODE, ("SG3D", data))], 1)

    def data(self):
        h = self.header
        text = lambda *words: b"".join(str(word).encode() + UT for word in words)  # noqa: E731
        dsid = struct.pack("<BIBB", 10, 1, 1, 5) + text("XX5TEST.000", h["edition"], h["update"])
        dsid += b"202601022026010203.1" + struct.pack("<B", 1) + text("", "2.0") + struct.pack("<BH", 1, 550) + text("")
        dssi = struct.pack("<BBB8I", 2, 1, 1, 0, 0, len(self.features), 0, len(self.spatial), 0, 0, 0)
        dspm = struct.pack(
            "<BIBBBIBBBBII", 20, 1, h["datum"], 16, 12, h["scale"], h["units"], 1, 1, 1, SCALE, 10
        ) + text("")
        return b"".join(
            [
                description(),
                record([("0001", struct.pack("<H", 1) + FT), ("DSID", dsid + FT), ("DSSI", dssi + FT)]),
                record([("0001", struct.pack("<H", 2) + FT), ("DSPM", dspm + FT)]),
                *self.spatial,
                *self.features,
            ]
        )
