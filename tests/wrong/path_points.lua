-- expect: 3: rd.path: sample 2 is not finite or at the one before it, points of a path differ
local rd = require "refdyn"
local path = rd.path { { 0, 0, 0 }, { 0, 0, 0 } }
