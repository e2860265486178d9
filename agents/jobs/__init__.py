"""Jobs side by side, in processes of this machine or on Ray: the same work, folders and bits either way."""
