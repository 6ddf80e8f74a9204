"""Pictures of a simulated world: one signature, two renderers, the choice between them."""
