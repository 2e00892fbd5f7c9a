"""Networks from the raw state to a command: features, normalisation and outputs inside one `nn.Module`."""
