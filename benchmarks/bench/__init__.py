"""Speed against error, beside other tools."""
