"""Dask over tls://: both ends show a certificate of one authority, and nobody else is talked to."""

from __future__ import annotations

import datetime
import json
from collections.abc import Iterator
from pathlib import Path

import pytest
from batching import bytes_of, environment, ring_sweep, unitcad
from test_batch_dask import Cluster

from unitcad.errors import UnitcadError
from unitcad.sweeps.cluster import Certificates
from unitcad.sweeps.executors import Workers

pytest.importorskip("distributed")
x509 = pytest.importorskip("cryptography.x509", reason="making certificates needs the cryptography package")


def _authority(folder: Path) -> tuple[str, ...]:
    """A certificate authority with one certificate of its own; the words that give both to a program."""
    from cryptography.hazmat.primitives import hashes, serialization
    from cryptography.hazmat.primitives.asymmetric import ec

    folder.mkdir()
    now = datetime.datetime.now(datetime.UTC)
    names = {who: x509.Name([x509.NameAttribute(x509.NameOID.COMMON_NAME, who)]) for who in ("authority", "member")}
    keys = {who: ec.generate_private_key(ec.SECP256R1()) for who in names}
    for who, name in names.items():
        certificate = (
            x509.CertificateBuilder()
            .subject_name(name)
            .issuer_name(names["authority"])
            .public_key(keys[who].public_key())
            .serial_number(x509.random_serial_number())
            .not_valid_before(now - datetime.timedelta(minutes=5))
            .not_valid_after(now + datetime.timedelta(hours=1))
            .add_extension(x509.BasicConstraints(ca=who == "authority", path_length=None), critical=True)
            .add_extension(x509.SubjectKeyIdentifier.from_public_key(keys[who].public_key()), critical=False)
            .add_extension(
                x509.AuthorityKeyIdentifier.from_issuer_public_key(keys["authority"].public_key()), critical=False
            )
            .sign(keys["authority"], hashes.SHA256())
        )
        (folder / f"{who}.pem").write_bytes(certificate.public_bytes(serialization.Encoding.PEM))
    (folder / "key.pem").write_bytes(
        keys["member"].private_bytes(
            serialization.Encoding.PEM, serialization.PrivateFormat.PKCS8, serialization.NoEncryption()
        )
    )
    return _words(folder)


def _words(folder: Path) -> tuple[str, ...]:
    files = {"--tls-ca-file": "authority.pem", "--tls-cert": "member.pem", "--tls-key": "key.pem"}
    return tuple(word for option, file in files.items() for word in (option, str(folder / file)))


@pytest.fixture(scope="module")
def encrypted(tmp_path_factory: pytest.TempPathFactory) -> Iterator[tuple[Cluster, tuple[str, ...]]]:
    folder = tmp_path_factory.mktemp("tls")
    ours = _authority(folder / "ours")
    (folder / "cluster").mkdir()
    cluster = Cluster(folder / "cluster", *ours, workers=1)
    yield cluster, ours
    cluster.close()


def test_a_cluster_behind_certificates_makes_the_same_bytes(encrypted, tmp_path: Path) -> None:
    cluster, ours = encrypted
    assert cluster.address.startswith("tls://")
    sweep, words = ring_sweep(tmp_path / "s", heights=[2.0, 3.0], materials=2), ("batch", "--json")
    by_options = unitcad(*words, sweep, "-o", tmp_path / "a", "--scheduler", cluster.address, *ours)
    assert by_options.returncode == 0, by_options.stderr
    assert json.loads(by_options.stdout)["ok"] == 4
    configured = {
        "DASK_DISTRIBUTED__COMM__TLS__CA_FILE": ours[1],
        "DASK_DISTRIBUTED__COMM__TLS__CLIENT__CERT": ours[3],
        "DASK_DISTRIBUTED__COMM__TLS__CLIENT__KEY": ours[5],
    }
    by_dask = unitcad(
        *words, sweep, "-o", tmp_path / "b", "--scheduler", cluster.address, env={**environment(), **configured}
    )
    assert by_dask.returncode == 0, by_dask.stderr
    here = unitcad(*words, sweep, "-o", tmp_path / "here", "-j", 1, "--cache", tmp_path / "other")
    assert here.returncode == 0, here.stderr
    assert bytes_of(tmp_path / "a") == bytes_of(tmp_path / "b") == bytes_of(tmp_path / "here")


def test_who_is_not_of_the_authority_is_not_talked_to(encrypted, tmp_path: Path) -> None:
    cluster, ours = encrypted
    others, sweep = _authority(tmp_path / "others"), ring_sweep(tmp_path / "s", heights=[2.0])
    for words in (others, (*ours[:2], *others[2:])):
        done = unitcad("batch", sweep, "-o", tmp_path / "o", "--scheduler", cluster.address, *words)
        assert done.returncode == 2, done.stderr
        assert done.stderr.startswith(f"error: --scheduler {cluster.address}: ")
        assert len(done.stderr.splitlines()) == 1
        assert not (tmp_path / "o" / "variants.csv").exists()


@pytest.mark.parametrize(
    ("address", "files", "message"),
    [
        ("tls://127.0.0.1:9", [], "needs --tls-ca-file, --tls-cert and --tls-key"),
        ("tls://127.0.0.1:9", ["none.pem"], "--tls-ca-file = '{}/none.pem': there is no such file"),
        ("tls://127.0.0.1:9", ["text", "text", "text"], "the certificates can't be used: "),
        ("tcp://127.0.0.1:9", ["text"], "--tls-ca-file = '{}/text': needs a --scheduler at tls://"),
        (None, ["text"], "--tls-ca-file = '{}/text': needs a --scheduler at tls://"),
    ],
)
def test_certificates_that_can_not_be_used(address: str | None, files: list[str], message: str, tmp_path: Path) -> None:
    (tmp_path / "text").write_text("no certificate\n")
    opened = Workers(None, address, Certificates(*(tmp_path / file for file in files))).executor()
    with pytest.raises(UnitcadError) as error, opened:
        pass
    assert message.format(tmp_path) in str(error.value)
