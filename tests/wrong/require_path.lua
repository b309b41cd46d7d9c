-- expect: 3: require: not a name; write "refdyn", or the name without .lua of a file in the folder of the model
local rd = require "refdyn"
local parts = require "../parts"
