"""Playing matches on rcssserver, unattended: from a schedule to folders of logs."""
