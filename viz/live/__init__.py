"""The live page: every running machine on the network, in a browser.

machines    what is known of each machine, and who wants to hear of it
network     finds machines and keeps their links
app         what a browser may ask for
security    who may ask for it
page        the files and models that a page is made of
"""
