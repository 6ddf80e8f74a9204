"""What truly was: what stands, what was visible, what moved. Estimators never see it."""
