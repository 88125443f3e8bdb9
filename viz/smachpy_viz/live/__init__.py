"""The live viewer: shows every running machine on the network in a browser or a terminal.

network      finds machines and receives their events
machines     the events and structure of each machine, and listeners for changes
runs         the list of live and recorded runs; `journals` adds durable missions
actions      the actions on the network, and goals sent from the page; `forms` describes goals
simulations  batches of simulated runs, started from the page
app          the HTTP interface: machine_routes, run_routes, command_routes, `streams` of events;
             `answers` has its JSON and errors, `security` protects it, `server` serves it
wire         the types of all that the page and its server send each other
assets       the files and data of the page
process      `smachpy view` as a child process
tui          the same in a terminal
cli          `smachpy view`
"""
