"""The postures one operator will take when a robot leads their hand."""
