-- expect: 2: require: socket.lua beside the model cannot be read: No such file or directory
local socket = require "socket"
