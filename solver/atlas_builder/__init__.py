"""Makes the atlas of contacts and its certificate, offline; no part of the installed package.

    python -m atlas_builder contacts|points|atlas|published       (in the folder solver)

screws.py draws screws, bearings and their contacts, contacts.py chooses and solves them, fit.py makes the atlas of
them, certificate.py compares it with direct solves, published.py solves the contacts of the packaged map of the
published law.
"""
