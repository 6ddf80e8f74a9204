"""Results of another algorithm, in any language, judged as flysim's own are."""
