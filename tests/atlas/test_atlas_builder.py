"""The tool that makes the atlas: its contacts, its journal, its executors, films of sliding balls, its certificate."""

import itertools
from concurrent.futures import ThreadPoolExecutor

import pytest
from synthetic_atlas import closed_contact, contacts, few_contacts, saved

from atlas_builder import contacts as chosen
from atlas_builder.contacts import journal_of, solve_contacts, usable


def test_first_contacts_of_more_are_those_of_fewer():
    """All different, every one with a film that is solved."""
    assert few_contacts(40) == contacts()[:40]
    assert all(usable(contact) for contact in contacts())
    assert len({contact.conditions for contact in contacts()}) == len(contacts())


@pytest.fixture
def solved(monkeypatch):
    found = []
    monkeypatch.setattr(chosen, "solve_contact", lambda c: found.append(c) or closed_contact(c))
    return found


def test_interrupted_work_continues_and_its_order_does_not_matter(solved, monkeypatch, tmp_path):
    """After a line that was cut off: the same bytes of the atlas as of contacts solved in the opposite order."""
    some, path, left = contacts()[:60], tmp_path / "x.jsonl", itertools.count()

    def interrupt(finished, total, what):
        if next(left) == 20:
            raise KeyboardInterrupt

    with ThreadPoolExecutor(1) as executor:
        with pytest.raises(KeyboardInterrupt), journal_of(path) as journal:
            solve_contacts(some, journal, executor, interrupt)
        kept = len(path.read_bytes().splitlines()) - 1
        assert kept >= 21
        path.write_bytes(path.read_bytes()[:-20])
        solved.clear()
        with journal_of(path) as journal:
            assert len(journal) == kept - 1
            with pytest.raises(ValueError, match=r"x\.jsonl: another run is writing it"), journal_of(path):
                pass
            found = solve_contacts(some, journal, executor)
    assert len(solved) == 60 - kept + 1
    # without its end, a line that follows would stand on the same line
    path.write_bytes(path.read_bytes()[:-1])
    with journal_of(path) as journal:
        (lost,) = {str(k) for k in range(60)} - set(journal.entries)
        journal.add(lost, found[int(lost)])
    with journal_of(path) as journal:
        assert [journal.entries[str(k)] for k in range(60)] == found
    with journal_of(tmp_path / "back.jsonl") as journal:
        for k in reversed(range(60)):
            journal.add(str(k), closed_contact(some[k]))
    with journal_of(tmp_path / "back.jsonl") as journal:
        back = [journal.entries[str(k)] for k in range(60)]
    files = [saved(tmp_path / f"{n}.npz", some, results) for n, results in enumerate((found, back))]
    assert files[0].read_bytes() == files[1].read_bytes()
    monkeypatch.setattr(chosen, "FINE_NODES", (129,))
    before = path.read_bytes()
    with pytest.raises(ValueError, match=r"contacts of the atlas.*expected"), journal_of(path):
        pass
    assert path.read_bytes() == before
