-- expect: 5: more than 100 million steps to read the model, a loop has no end?
-- Tries a loop of goto.
local rd = require "refdyn"
::again::
goto again
return rd.model { name = "harmful", links = { { "a", joint = "x", mass = 1 } } }
