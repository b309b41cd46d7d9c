-- Tries a loop of goto.
local rd = require "refdyn"
::again::
goto again
return rd.model { name = "harmful", links = { { "a", joint = "x", mass = 1 } } }
