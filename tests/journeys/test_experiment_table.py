"""Result table of `rotorsim experiment`."""

from rotorsim.experiments import Controlled


def test_a_loop_at_its_limit_most_of_the_time_is_not_called_in_control():
    """A sensor with the wrong sign gives a limit cycle between the limits of the references."""

    def saturation(limited, samples):
        ((_, text),) = Controlled.table({"saturated_samples": limited, "samples": samples})
        return text

    assert saturation(12, 1200) == "12 samples, 1 %"
    assert "not in control; check the signs" in saturation(1100, 1200)
