"""Playing matches on rcssserver, unattended: from a plan to folders of logs."""
