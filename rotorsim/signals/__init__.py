"""Signal analysis of records: orders, spectra, frequency responses, ring-downs, runout, static gains; no plotting."""
