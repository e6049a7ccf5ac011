"""Regions that are found: paints of different maps fall apart, and what cannot be divided is refused."""

import numpy as np
import pytest

import impasto
from impasto.errors import OptionError
from impasto.evaluate.clusters import cluster_regions
from impasto.store import open_fit


def test_clusters_are_the_paints_that_were_painted(tmp_path):
    """Two paints side by side, of which one is white and the other dark, whatever their highlights."""
    impasto.simulate(tmp_path / "photos", preset="swatches", dome=True, lights=16, size=(60, 48))
    store = tmp_path / "p.zarr"
    impasto.stack(tmp_path / "photos", store)
    impasto.fit(store, models=["torrance-sparrow"])
    fit = open_fit(store, "torrance-sparrow")
    regions = cluster_regions(fit, 6, show=False)
    again = cluster_regions(fit, 6, show=False)
    np.testing.assert_array_equal(regions.label, again.label)
    assert regions.names == tuple(f"cluster {number}" for number in range(1, 7))
    sizes = np.bincount(regions.label.ravel(), minlength=7)[1:]
    assert (np.diff(sizes) <= 0).all()
    diffuse = fit.read(slice(0, 48), slice(0, 60), ["diffuse"])["diffuse"]
    within = np.mean([diffuse[regions.label == number].std(axis=0) for number in range(1, 7)])
    assert within < 0.5 * diffuse.reshape(-1, 3).std(axis=0).mean()


def test_the_spread_is_over_the_regions(painting, tmp_path):
    summary = impasto.compare(painting, clusters=3, out=tmp_path)
    assert [region.name for region in summary.regions[1:]] == ["cluster 1", "cluster 2", "cluster 3"]
    for index, spread in enumerate(summary.spread):
        ratios = [region.models[index].ratio.mean for region in summary.regions[1:]]
        assert spread.mean == pytest.approx(np.mean(ratios))
        assert spread.sd == pytest.approx(np.std(ratios, ddof=1))
        assert (spread.low, spread.high) == (min(ratios), max(ratios))
    assert {path.name for path in summary.files} >= {"clusters.tif", "clusters.png"}


def test_gloss_and_gonio_take_clusters_too(painting, tmp_path):
    gloss = impasto.gloss(painting, model="torrance-sparrow", clusters=2)
    assert [region.name for region in gloss.regions] == ["whole painting", "cluster 1", "cluster 2"]
    gonio = impasto.gonio(painting, out=tmp_path, clusters=2)
    assert [curve.name for curve in gonio.curves] == ["cluster 1", "cluster 2"]


@pytest.mark.parametrize("count", [0, 1, 13])
def test_a_number_of_clusters_out_of_range_is_refused(painting, count):
    with pytest.raises(OptionError, match="not from 2 to 12"):
        impasto.compare(painting, clusters=count)


def test_a_painting_is_divided_in_one_way(painting, tmp_path):
    with pytest.raises(OptionError, match="both divide"):
        impasto.gloss(painting, model="phong", regions=tmp_path / "drawn.png", clusters=2)
