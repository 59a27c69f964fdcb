"""The Record tab: capture, meters, health, takes of today.

countdown              The countdown before a take
health_presenter       Presenter of the health card, and of what the status strip says of motion and sound
health_view            The health card: in words a performer understands, each with what to do
input_tests_presenter  Presenters of the level test and the sync test of the inputs
inputs_presenter       Presenter of the inputs card: devices and ports opened one after another; a phone
inputs_view            The inputs card: where motion and sound come from, and how loud
model                  What the tab knows: the recorder, whether it rolls, the slate; and word of what changed
phone_link             Asks the apps of a phone that send their face only to who asks
playback               A take of today heard again while the figure moves
presenter              Presenter of the tab: builds its model and its cards, asks before a recording is closed
prompter_presenter     Presenter of the teleprompter: what to say next, hands-free, kept as labels of the take
prompter_view          The teleprompter: what to say, and a ring that fills up to twenty minutes
slate_presenter        Presenter of the bar under the figure: the next take, its button, its clock, the disk
slate_view             Under the figure: slate, take number, time, the one red button, countdown, pre-roll
stage_presenter        Presenter of the figure and the shape meters
takes_presenter        Presenter of the takes of today: heard again, kept, noted, thrown away
takes_view             The takes of today: hear, keep, do again, note
task                   The practice performer in the window: a child process
tracker_pictures       Pictures of the tracker cards: the steps, and the code for a phone
trackers_presenter     Presenter of the tracker cards: finds who sends, and listens to it from then on
trackers_view          How are you tracked? A card for each tracker, with its steps, its light and its address
view                   Layout of the tab and its keys
webcam_presenter       Presenter of the webcam's page: its camera in a child process, its model, its hints
webcam_view            The webcam's page among the trackers: what the camera sees, and what would help it
"""
