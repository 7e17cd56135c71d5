"""Machine-file parts of the bearings: gas films and their sleeves, linear ones and tables, housings, names."""
