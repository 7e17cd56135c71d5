"""Commands that write on full and read-only disks: one sentence, exit code 2, complete samples kept."""

from fault_injection.cases import ALL, DISK, NIGHTLY, SHARES
from fault_injection.trials import complete, dated, disk, tally

pytestmark = NIGHTLY


@DISK
@ALL
def test_a_full_disk(command, trials, reference):
    """One that grows from try to try, each time by too little."""
    found, known, trial = [], reference(command), trials(command)
    given = sum(path.stat().st_size for path in trial.out.rglob("*") if path.is_file())
    with disk(trial.out, 2 * given) as change:
        trial.begin()
        for k, share in enumerate(SHARES):
            change(f"size={max(int(2 * given + share * max(known.size - given, 0)), 4096)}")
            ended = trial.run(force=k > 0)
            found += dated(trial.found(ended, complete(trial, ended, {2, command.code}), known), f"disk of {share:.0%}")
        change("size=1g")
        found += dated(trial.again(known), "again")
    tally(command, "full disk", len(SHARES), found)


@ALL
def test_a_limit_on_the_size_of_a_file(command, trials, reference):
    """The other way for a write to fail: EFBIG."""
    found, known, trial = [], reference(command), trials(command)
    for k, share in enumerate(SHARES[:-1:2]):
        ended = trial.run(largest=1000 + int(share * known.largest), force=k > 0)
        found += dated(trial.found(ended, complete(trial, ended, {2, command.code}), known), f"files of {share:.0%}")
    tally(command, "file limit", len(SHARES[:-1:2]), found + dated(trial.again(known), "again"))


@DISK
@ALL
def test_a_disk_that_cannot_be_written(command, trials, reference):
    trial, known = trials(command), reference(command)
    with disk(trial.out, known.size * 3 + 1_000_000) as change:
        trial.begin()
        before = sorted(trial.out.rglob("*"))
        change("ro")
        found = dated(trial.found(trial.run(), {2}, known), "read-only")
        assert sorted(trial.out.rglob("*")) == before
        change("rw")
        tally(command, "read-only", 1, found + trial.again(known))
