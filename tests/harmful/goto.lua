-- expect: 5: more than 100 million steps to read the model; look for a loop without an end
-- Tries a loop of goto.
local rd = require "refdyn"
::again::
goto again
return rd.model { name = "harmful", links = { { "a", joint = "x", mass = 1 } } }
