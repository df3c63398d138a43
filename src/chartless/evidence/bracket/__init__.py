"""Different exposures of one scene: ratios of light are known."""
